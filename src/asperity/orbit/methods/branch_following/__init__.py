"""An orbit followed from steady sliding to the requested amplitude, through folds."""
