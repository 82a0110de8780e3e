"""Runs pairs on Mosquitto: the broker as a process, clients that do what MQTT asks and no more, links that can be cut."""
