"""Published papers, reproduced with `asperity`: one folder each, registered by its entry point."""
