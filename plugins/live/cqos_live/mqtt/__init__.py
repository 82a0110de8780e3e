"""What is MQTT about running middleware: pairs on Mosquitto, and brokers that say what they know."""
