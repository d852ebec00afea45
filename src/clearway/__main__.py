"""`clearway`, the installed script, and `python -m clearway`."""

import gc
import sys

from clearway.base.stray_settings import ignore_stray_settings

NEW_OBJECTS = 250_000
"""So many more objects than before are looked through for what nothing leads to any more."""

ignore_stray_settings()  # In worker processes too: they load this module, and nothing of it runs.


def main() -> None:
    """The command line; Ctrl-C while it is still being loaded ends it as it does later."""
    # What is loaded is there to stay; Python would look through it for what to free at every turn.
    gc.set_threshold(NEW_OBJECTS, *gc.get_threshold()[1:])
    try:
        from clearway.cli.app import main as run

        run()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)  # `INTERRUPTED` of what may not be loaded yet.


if __name__ == "__main__":
    main()
