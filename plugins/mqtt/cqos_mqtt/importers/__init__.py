"""Readers of the files in which people write what MQTT clients and brokers do."""
