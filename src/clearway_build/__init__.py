"""The build of the compiled core: loops of Python to C++, and C++ to an extension module."""
