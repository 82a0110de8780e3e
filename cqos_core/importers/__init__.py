"""Importers: bytes in one of many formats become a `System`."""
