"""Reads launch files as text: what would start, under which names, with what, and what is not known. Nothing is executed."""
