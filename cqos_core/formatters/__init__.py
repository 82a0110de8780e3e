"""Formatters: a `Report` becomes text."""
