"""Systems and reports as pictures: one HTML page, and graphs for Graphviz and Mermaid. Templates, style and script are in ``html/``."""
