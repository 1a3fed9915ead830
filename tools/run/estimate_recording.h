#pragma once

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "core/warnings.h"
#include "core/work_times.h"
#include "estimators/estimator.h"
#include "frontends/configuration/output_file.h"
#include "tools/run/fingerprint.h"

namespace lodestone {

/// Results of a pass over a log in addition to its estimates.
struct PassRecord {
  double wall_s = 0.0;
  double refine_s = 0.0;
  double peak_rss_mb = 0.0;
  WorkTimes work_s{};
  WarningLog warnings;
};

/// Writes all estimates of one estimator to a file for `run --resume`. The file appears when the estimator has ended.
/// Numbers are stored as in memory, so that only the same program may read the file.
class EstimateRecorder final : public EstimateSink {
 public:
  /// Throws InputError if the folder of `path` cannot be written.
  explicit EstimateRecorder(const std::filesystem::path& path) : file_(path) {}

  void causal(const Estimate& estimate) override { write(Kind::causal, estimate); }
  void best(const Estimate& estimate) override { write(Kind::best, estimate); }
  void smoothed(const Estimate& estimate) override { write(Kind::smoothed, estimate); }

  /// Completes the file. Throws InputError if the disk is full.
  void finish(const PassRecord& pass);

 private:
  friend class EstimateRecording;
  enum class Kind : std::uint8_t { causal, best, smoothed };
  void write(Kind kind, const Estimate& estimate);
  void write(std::string_view bytes);

  OutputFile file_;
  std::uint64_t hash_ = kHashOfNothing;
  std::string failure_;  // why no more bytes are written
};

/// The content of a recording.
class EstimateRecording {
 public:
  /// Nothing if there is no such file, or if the file is damaged.
  static std::optional<EstimateRecording> read(const std::filesystem::path& path);

  /// Passes every estimate to `sink`, in the recorded order.
  void replay(EstimateSink& sink) const;

  const PassRecord& pass() const { return pass_; }

 private:
  std::vector<std::pair<EstimateRecorder::Kind, Estimate>> estimates_;
  PassRecord pass_;
};

}  // namespace lodestone
