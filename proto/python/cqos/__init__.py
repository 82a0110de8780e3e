"""What is generated from the contract with modelers, version by version."""
