"""Tables with units, uncertainties and reasons for what is missing."""
