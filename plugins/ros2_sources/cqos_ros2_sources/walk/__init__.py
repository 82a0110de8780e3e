"""The walk of a program: it follows calls and values to the nodes and endpoints that the program makes."""
