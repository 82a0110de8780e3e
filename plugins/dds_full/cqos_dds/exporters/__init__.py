"""Exporters to the XML forms that implementations of DDS read."""
