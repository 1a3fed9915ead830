#include "tools/run/run_checkpoint.h"

#include <fmt/format.h>

#include <cereal/types/utility.hpp>
#include <cstring>

#include "core/error.h"
#include "estimators/serialization.h"
#include "frontends/configuration/text_file.h"
#include "tools/writers/output_file.h"

namespace lodestone {

template <class Archive>
void serialize(Archive& archive, FileExtent& extent) {
  auto& [bytes, hash] = extent;
  archive(bytes, hash);
}

template <class Archive>
void save(Archive& archive, const WarningLog& warnings) {
  archive(warnings.entries().size());
  for (const auto& [kind, entry] : warnings.entries()) {
    archive(kind, entry.count, entry.first_detail, entry.first_time, entry.last_time);
  }
}

template <class Archive>
void load(Archive& archive, WarningLog& warnings) {
  std::size_t kinds = 0;
  archive(kinds);
  for (std::size_t i = 0; i < kinds; ++i) {
    std::string kind;
    WarningLog::Entry entry;
    archive(kind, entry.count, entry.first_detail, entry.first_time, entry.last_time);
    warnings.add(kind, entry.first_detail, entry.first_time, entry.count);
    warnings.add(kind, entry.first_detail, entry.last_time, 0);
  }
}

template <class Archive>
void serialize(Archive& archive, PassState& pass) {
  auto& [scans, last_end, wall_s, peak_rss_mb, warnings] = pass;
  archive(scans, last_end, wall_s, peak_rss_mb, warnings);
}

namespace {

constexpr std::string_view kBegin = "lodestone checkpoint 1\n";

}  // namespace

RunCheckpoint::RunCheckpoint(const std::filesystem::path& folder, const std::string& estimator, double interval_s,
                             RunIdentity identity)
    : state_path_(folder / (estimator + ".state")),
      estimates_(folder / (estimator + ".estimates")),
      keyframes_(folder / (estimator + ".keyframes")),
      interval_s_(interval_s),
      identity_(std::move(identity)),
      told_(std::ios::binary) {}

bool RunCheckpoint::exists() const {
  std::error_code ignored;
  return std::filesystem::exists(state_path_, ignored);
}

PassState RunCheckpoint::read() {
  const std::string content = read_text_file(state_path_.string());
  const auto damaged = [&](const std::string& how) {
    return InputError(fmt::format("{}: {}; run without --resume to begin anew", state_path_.string(), how));
  };
  std::uint64_t hash = 0;
  const std::size_t head = kBegin.size() + sizeof(hash);
  if (content.size() < head || !content.starts_with(kBegin)) throw damaged("no checkpoint of this program, or cut off");
  std::memcpy(&hash, content.data() + kBegin.size(), sizeof(hash));
  if (hash_of(std::string_view(content).substr(head)) != hash) throw damaged("damaged or cut off");
  std::istringstream stream(content.substr(head), std::ios::binary);
  StateReader reader(stream);
  RunIdentity written;
  reader(written);
  if (const std::string difference = difference_between(written, identity_); !difference.empty()) {
    throw damaged(fmt::format("this checkpoint cannot be resumed: {}", difference));
  }
  PassState pass;
  FileExtent estimates;
  FileExtent keyframes;
  reader(pass, estimates, keyframes, estimator_state_);
  told_before_ = estimates_.read(estimates);
  lasting_before_ = keyframes_.read(keyframes);
  return pass;
}

void RunCheckpoint::restore(Estimator& estimator, EstimateSink& sink) {
  std::istringstream state(std::move(estimator_state_), std::ios::binary);
  std::istringstream lasting(std::move(lasting_before_), std::ios::binary);
  StateReader state_reader(state);
  StateReader lasting_reader(lasting);
  estimator.load(state_reader, lasting_reader);
  std::istringstream told(std::move(told_before_), std::ios::binary);
  StateReader told_reader(told);
  while (told.peek() != std::istringstream::traits_type::eof()) {
    Told what{};
    Estimate estimate;
    told_reader(what, estimate);
    switch (what) {
      case Told::causal:
        sink.causal(estimate);
        break;
      case Told::best:
        sink.best(estimate);
        break;
      case Told::smoothed:
        sink.smoothed(estimate);
    }
  }
}

void RunCheckpoint::take_down(Told what, const Estimate& estimate) {
  StateWriter writer(told_);
  writer(what, estimate);
}

bool RunCheckpoint::due() const { return std::chrono::duration<double>(Clock::now() - last_).count() >= interval_s_; }

void RunCheckpoint::write(Estimator& estimator, const PassState& pass) {
  std::ostringstream state(std::ios::binary);
  std::ostringstream lasting(std::ios::binary);
  {
    StateWriter state_writer(state);
    StateWriter lasting_writer(lasting);
    estimator.save(state_writer, lasting_writer);
  }
  estimates_.append(told_.view());
  told_.str({});
  keyframes_.append(lasting.view());
  std::ostringstream body(std::ios::binary);
  StateWriter writer(body);
  writer(identity_, pass, estimates_.extent(), keyframes_.extent(), state.str());
  const std::uint64_t hash = hash_of(body.view());
  OutputFile file(state_path_);
  file.write(kBegin);
  file.write({reinterpret_cast<const char*>(&hash), sizeof(hash)});
  file.write(body.view());
  file.commit();
  last_ = Clock::now();
}

}  // namespace lodestone
