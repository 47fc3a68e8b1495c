"""Values of drives for other programs of the plant: metrics for Prometheus, messages for MQTT."""
