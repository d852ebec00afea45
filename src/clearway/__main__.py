"""`python -m clearway`: the command line without an installed script."""

from clearway.cli.app import main

if __name__ == "__main__":
    main()
