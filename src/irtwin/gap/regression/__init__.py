"""The equations of one channel: candidate columns, normal equations, evidence of hypotheses, residuals."""
