"""Importers of the files in which DDS people keep their QoS, and whole systems."""
