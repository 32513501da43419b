"""The event loop: integration, location of events, impacts and resting contact."""
