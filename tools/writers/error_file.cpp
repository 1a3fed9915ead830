#include "tools/writers/error_file.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/evaluation/errors.h"
#include "frontends/configuration/output_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/writers/csv_table.h"

namespace lodestone {

std::vector<ErrorRow> error_rows(const PosePairs& pairs, const std::vector<Matrix6>& covariances) {
  if (pairs.size() != covariances.size()) throw std::invalid_argument("error_rows: expected one covariance per pair");
  const std::vector<double> headings = heading_errors(pairs);
  std::vector<ErrorRow> rows;
  rows.reserve(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vector3 error = pairs[i].estimate.position - pairs[i].truth.position;
    rows.push_back({pairs[i].time, error, error.norm(), headings[i] * 180.0 / std::numbers::pi,
                    std::sqrt(covariances[i].bottomRightCorner<3, 3>().trace())});
  }
  return rows;
}

void write_errors(const std::filesystem::path& path, const std::vector<ErrorRow>& rows) {
  OutputFile file(path);
  file.write("t_s,error_x_m,error_y_m,error_z_m,error_m,heading_error_deg,position_sigma_m\n");
  for (const ErrorRow& row : rows) {
    file.write(fmt::format("{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", format_stamp(row.time), row.position_m.x(),
                           row.position_m.y(), row.position_m.z(), row.norm_m, row.heading_deg, row.position_sigma_m));
  }
  file.commit();
}

std::vector<ErrorRow> read_errors(const std::filesystem::path& path) {
  const CsvTable table(path);
  const std::vector<Time> times = table.stamps("t_s");
  const std::vector<Vector3> error = table.vectors("error_", "_m");
  const std::vector<double> norm = table.numbers("error_m");
  const std::vector<double> heading = table.numbers("heading_error_deg");
  const std::vector<double> sigma = table.numbers("position_sigma_m");
  std::vector<ErrorRow> rows;
  rows.reserve(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    rows.push_back({times[i], error[i], norm[i], heading[i], sigma[i]});
  }
  return rows;
}

}  // namespace lodestone
