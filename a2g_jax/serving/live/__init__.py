"""Live motion over a WebSocket: protocol, sessions, and the page with a microphone."""
