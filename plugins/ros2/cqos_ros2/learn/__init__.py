"""What nodes create, read from their sources in C++ and Python: from files to node files. Nothing is executed or imported."""
