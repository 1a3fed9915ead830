#pragma once

#include <filesystem>
#include <optional>

#include "tools/experiments/plan.h"

namespace lodestone::reproduce {

/// Finished steps and their files in the output folder. A step is done if its folder has a stamp with its fingerprint.
/// The stamp is written last and removed first: an interrupted step never counts as done.
class StepStore {
 public:
  /// `any_build`: accept finished steps of another build of the program. Makes the folder and locks it against other
  /// calls. Children inherit the lock: if the parent is killed, the folder stays locked until they exit. Throws
  /// InputError if the folder cannot be made or is locked.
  StepStore(std::filesystem::path root, bool any_build);
  ~StepStore();
  StepStore(const StepStore&) = delete;
  StepStore& operator=(const StepStore&) = delete;

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path log_of(const Step& step) const;

  bool is_done(const Step& step) const;

  /// The text of the stamp, which is written into the folder of a finished step (tools/fleet/experiment_step.py).
  static std::string stamp_of(const Step& step);

  /// Removes the folders of all steps of `plan` that are not kept.
  void remove_elapsed(const Plan& plan) const;

  /// Removes work folders that belong to no step of `plan`: remains of an interrupted call. Maps shown by the figures
  /// of another call are kept.
  void remove_strangers(const Plan& plan) const;

 private:
  std::filesystem::path root_;
  bool any_build_;
  int lock_ = -1;
};

}  // namespace lodestone::reproduce
