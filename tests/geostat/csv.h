#pragma once

#include <Eigen/Core>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace vlx::testing {

/// A comma-separated table with a header line; no quoted fields.
class CsvTable {
  public:
    explicit CsvTable(const std::string& path) : path_(path) {
        std::ifstream file(path);
        if (!file) throw std::runtime_error(path + ": cannot be read");
        std::string line;
        std::getline(file, line);
        const std::vector<std::string> names = split(line);
        for (std::size_t i = 0; i < names.size(); ++i) columns_[names[i]] = i;
        while (std::getline(file, line))
            if (!line.empty() && line != "\r") rows_.push_back(split(line));
    }

    std::size_t size() const { return rows_.size(); }
    bool has(const std::string& column) const { return columns_.count(column) > 0; }
    const std::string& text(std::size_t row, const std::string& column) const {
        const auto found = columns_.find(column);
        if (found == columns_.end()) throw std::runtime_error(path_ + ": no column " + column);
        return rows_.at(row).at(found->second);
    }
    double number(std::size_t row, const std::string& column) const { return std::stod(text(row, column)); }
    Eigen::VectorXd numbers(const std::string& column) const {
        Eigen::VectorXd values(static_cast<Eigen::Index>(rows_.size()));
        for (std::size_t i = 0; i < rows_.size(); ++i)
            values[static_cast<Eigen::Index>(i)] = number(i, column);
        return values;
    }

  private:
    static std::vector<std::string> split(const std::string& line) {
        std::vector<std::string> fields(1);
        for (const char c : line) {
            if (c == ',')
                fields.emplace_back();
            else if (c != '\r')
                fields.back() += c;
        }
        return fields;
    }

    std::string path_;
    std::map<std::string, std::size_t> columns_;
    std::vector<std::vector<std::string>> rows_;
};

}  // namespace vlx::testing
