"""Sources of C++ and Python as programs of one form."""
