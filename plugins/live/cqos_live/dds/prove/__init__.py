"""Runs of pairs on Cyclone DDS and Fast DDS: what `cqos prove` starts, and what the conformance runs compare the pack with."""
