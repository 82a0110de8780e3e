"""Derives certain facts about time from a design: from control flow, and over several hops.

`analysis.Behaviour` analyses the control flow of `cqos_core.model.flow`: which events may happen, how often, and in which order. The
analyses name no protocol, are exact and linear in the size of the model, and claim nothing about what they do not understand. `findings`
compares them with the policies that packs name. `paths` follows data over several hops.
"""
