"""One benchmark a file: `measure()` yields its tables."""
