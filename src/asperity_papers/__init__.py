"""Published papers, reproduced with `asperity`: one folder each, found by its entry point."""
