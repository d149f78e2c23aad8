"""Sessions: benches with the work under way for them and the pages that look at them."""
