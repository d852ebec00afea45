"""Builds the compiled core: kernels translated to C++, compiled, and put beside the package.

Needs Python, numpy's headers and a C++20 compiler, but not clearway itself. Not in the wheel.
"""
