"""Live pages: HTML pages that simulate a mechanism in the browser, without a network."""
