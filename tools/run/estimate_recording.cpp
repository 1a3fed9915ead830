#include "tools/run/estimate_recording.h"

#include <cstring>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "frontends/configuration/text_file.h"

namespace lodestone {

namespace {

// File format: estimates, each after one byte for its kind; the pass as JSON; the trailer below.
struct End {
  std::uint64_t pass_bytes = 0;
  std::uint64_t hash = 0;  ///< of all bytes before the trailer
};

constexpr std::size_t kEntryBytes = 1 + sizeof(Estimate);

template <class Plain>
std::string_view bytes_of(const Plain& value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

template <class Plain>
void read_bytes(std::string_view bytes, Plain& value) {
  std::memcpy(reinterpret_cast<char*>(&value), bytes.data(), sizeof(value));
}

std::string text_of(const PassRecord& pass) {
  nlohmann::json json{{"wall_s", pass.wall_s},
                      {"refine_s", pass.refine_s},
                      {"peak_rss_mb", pass.peak_rss_mb},
                      {"work_s", pass.work_s},
                      {"warnings", nlohmann::json::array()}};
  for (const auto& [kind, entry] : pass.warnings.entries()) {
    json["warnings"].push_back({kind, entry.count, entry.first_detail, entry.first_time, entry.last_time});
  }
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

PassRecord pass_of(std::string_view text) {
  const nlohmann::json json = nlohmann::json::parse(text);
  PassRecord pass{json["wall_s"], json["refine_s"], json["peak_rss_mb"], json["work_s"], {}};
  for (const nlohmann::json& entry : json["warnings"]) {
    pass.warnings.add(entry[0].get<std::string>(), entry[2].get<std::string>(), entry[3].get<Time>(),
                      entry[1].get<std::int64_t>());
    pass.warnings.add(entry[0].get<std::string>(), entry[2].get<std::string>(), entry[4].get<Time>(),
                      0);  // time of the last occurrence
  }
  return pass;
}

}  // namespace

void EstimateRecorder::write(std::string_view bytes) {
  if (!failure_.empty()) return;
  try {
    file_.write(bytes);
  } catch (const InputError& error) {
    failure_ = error.what();  // the run goes on; finish() reports this
  }
  hash_ = hash_of(bytes, hash_);
}

void EstimateRecorder::write(Kind kind, const Estimate& estimate) {
  write(bytes_of(kind));
  write(bytes_of(estimate));
}

void EstimateRecorder::finish(const PassRecord& pass) {
  const std::string text = text_of(pass);
  write(text);
  const End end{text.size(), hash_};
  write(bytes_of(end));
  if (!failure_.empty()) throw InputError(failure_);
  file_.commit();
}

std::optional<EstimateRecording> EstimateRecording::read(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return std::nullopt;
  const std::string content = read_text_file(path.string());
  std::string_view rest(content);
  End end;
  if (rest.size() < sizeof(end)) return std::nullopt;
  read_bytes(rest.substr(rest.size() - sizeof(end)), end);
  rest.remove_suffix(sizeof(end));
  if (hash_of(rest) != end.hash || end.pass_bytes > rest.size()) return std::nullopt;
  EstimateRecording recording;
  recording.pass_ = pass_of(rest.substr(rest.size() - end.pass_bytes));
  rest.remove_suffix(end.pass_bytes);
  for (; rest.size() >= kEntryBytes; rest.remove_prefix(kEntryBytes)) {
    auto& [kind, estimate] = recording.estimates_.emplace_back();
    read_bytes(rest, kind);
    read_bytes(rest.substr(1), estimate);
  }
  return recording;
}

void EstimateRecording::replay(EstimateSink& sink) const {
  for (const auto& [kind, estimate] : estimates_) {
    if (kind == EstimateRecorder::Kind::causal) sink.causal(estimate);
    if (kind == EstimateRecorder::Kind::best) sink.best(estimate);
    if (kind == EstimateRecorder::Kind::smoothed) sink.smoothed(estimate);
  }
}

}  // namespace lodestone
