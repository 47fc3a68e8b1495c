"""Values of drives for programs of the plant: metrics for Prometheus, messages for a broker."""
