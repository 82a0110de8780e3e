"""A pair over MQTT as a Promela model with an LTL formula for each guarantee, and SPIN's answers to it."""
