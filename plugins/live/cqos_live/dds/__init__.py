"""What is DDS about running middleware: pairs on Cyclone DDS and Fast DDS, and domains that Cyclone DDS looks into."""
