//! Where the excess of residuals over the noise floor sits.
