"""The equations of one channel: candidate columns, normal equations, residuals, cross-validation, significance."""
