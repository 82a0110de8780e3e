"""``cqos snapshot mqtt``: what a broker knows of its clients as a system file.

`brokers` asks the management interfaces of brokers, and the importer `mosquitto_log` reads what Mosquitto wrote. Both answer with
clients of `seen`, which makes a system of them. `command` is the command.
"""
