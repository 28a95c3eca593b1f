"""The loop in the browser, live or from a bag: its state, and the page that shows it."""
