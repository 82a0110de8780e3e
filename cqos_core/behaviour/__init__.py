"""What a design says for certain about time: from control flow, and over several hops.

`analysis.Behaviour` has the analyses of a graph of `cqos_core.model.flow`: which events may happen, how often, and in which order. They
name no protocol, they are linear in the size of the model and exact, and what they do not understand gives no claim. `findings` compares
what they say with the policies that packs name. `paths` has what arrives over several hops.
"""
