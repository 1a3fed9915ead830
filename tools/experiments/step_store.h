#pragma once

#include <filesystem>
#include <optional>

#include "tools/experiments/plan.h"

namespace lodestone::reproduce {

/// What lies in the output folder: which steps are done, and their files. A step counts as done when its folder holds a
/// stamp with its fingerprint. The stamp is written last and removed first, so that nothing half done is believed.
class StepStore {
 public:
  /// With `any_build` what another build of the program made counts as done too. Makes the folder and locks it against
  /// another call; children inherit the lock, so that it outlives a killed parent until they have ended. Throws
  /// InputError where the folder cannot be made or is locked.
  StepStore(std::filesystem::path root, bool any_build);
  ~StepStore();
  StepStore(const StepStore&) = delete;
  StepStore& operator=(const StepStore&) = delete;

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path log_of(const Step& step) const;

  bool is_done(const Step& step) const;

  /// Empties the step's folder and its log.
  void begin(const Step& step) const;

  /// Removes the intermediate files and writes the stamp.
  void finish(const Step& step) const;

  /// Removes the step's folder.
  void remove(const Step& step) const;

  /// Removes folders of work that belong to no step of `plan`: left over by another call that was stopped. Maps that
  /// another call's figures show stay.
  void remove_strangers(const Plan& plan) const;

 private:
  std::filesystem::path root_;
  bool any_build_;
  int lock_ = -1;
};

}  // namespace lodestone::reproduce
