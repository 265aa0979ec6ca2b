"""Nonlinear least squares: residuals of all windows, normal equations, Levenberg-Marquardt, standard errors."""
