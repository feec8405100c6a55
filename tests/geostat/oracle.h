#pragma once

#include <string>

/// Rows of the oracle's tables that were reproduced, and that were not (each with a line on stdout).
struct OracleCount {
    int passed = 0;
    int failed = 0;
};

/// Empirical variograms, model curves and fits of a folder with the tables of testdata/oracle.
OracleCount runVariography(const std::string& dir);

/// Predictions and leave-one-out of such a folder.
OracleCount runPredictions(const std::string& dir);
