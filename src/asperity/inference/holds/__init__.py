"""Healing against hold time as data of a fit."""
