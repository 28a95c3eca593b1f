"""A run in the browser, live or from a bag: what is known of the loop, and the page showing it."""
