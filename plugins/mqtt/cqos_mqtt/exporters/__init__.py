"""Writes systems in forms that tools for MQTT read."""
