"""What acts in some runs or for a while only, found before any effect is tried: contacts, payloads, ripples."""
