"""Results as text: properties of an arm, what planning found, comparisons, recordings."""
