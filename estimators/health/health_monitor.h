#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "estimators/health/motion_check.h"
#include "estimators/health/place_evidence.h"
#include "estimators/verdict.h"

namespace lodestone {

/// What carries an estimate along a direction that neither scans nor readings observe.
enum class Reckoning {
  learned_imu,  ///< after some seconds that are observed, a small tilt and bias remain; before, as `mounted_imu`
  mounted_imu,  ///< the scans hold it at a tilt as wrong as the platform file's mounting of the LiDAR may be
  scans         ///< they move it whatever the IMU says
};

/// The longest wait between two searches that found nothing.
inline constexpr double kLongestWait_s = 60.0;

/// Judges each estimate by its covariance and by how scans and readings agree with the maps, whatever the estimator
/// made of them: at a wrong place the covariance stays small, for some points and readings always fit.
class HealthMonitor {
 public:
  /// `input` must outlive this.
  HealthMonitor(const EstimatorInput& input, Reckoning reckoning);

  /// The newest estimate of a bundle, in order of time: sets its health, and the evidence in its diagnostics.
  void judge(const ScanBundle& bundle, Estimate& causal);

  /// How scan and readings of a bundle agree with the maps at an estimate that is not the newest.
  PlaceEvidence evidence(const ScanBundle& bundle, const Estimate& estimate) { return judge_.judge(bundle, estimate); }

  /// The estimate of a time once it is refined: by its own covariance and the evidence of that time.
  Verdict judge_refined(const Estimate& refined) const;

  /// Whether scans and the readings of several stations fitted the estimate in the last minute, and scans or dead
  /// reckoning have kept the place since. Then it is the magnetic map that has changed.
  bool is_confirmed() const;

  /// One sigma of what an estimate can have drifted since all directions were last observed.
  double unobserved_m() const;

  /// The place beside the newest estimate that scans prefer, if they do so clearly (NearbyCheck).
  std::optional<Pose> better_nearby() const { return nearby_.better(); }

  /// The way (map axes) to the place beside the newest estimate that scans prefer, however likely.
  std::optional<Vector3> way_nearby() const { return nearby_.way(); }

  /// The estimator was moved to better_nearby().
  void moved();

  /// Forgets the evidence of an estimator that was lost; its verdicts stay.
  void restart();

 private:
  /// Return whether the scan's points, and its readings, contradict the maps.
  bool add_scan(const PlaceEvidence& evidence, double step_s);
  bool add_readings(const PlaceEvidence& evidence, const Estimate& causal, double step_s);
  void record(Time time, const Verdict& by_evidence);
  Verdict judge_observation(const ScanBundle& bundle, const Estimate& causal, double step_s);
  Verdict judge_evidence() const;
  Verdict judge_motion() const;
  Verdict judge_nearby(const ScanBundle& bundle, const Estimate& causal);
  Verdict judge_awaited(Time time) const;
  bool stations_contradict() const;
  void confirm(const PlaceEvidence& evidence, const ScanBundle& bundle, const Estimate& causal, double step_s);
  bool readings_fit(const PlaceEvidence& evidence) const;
  double sum_of_odds() const;
  double unknown_acceleration_m_s2() const;

  /// Field evidence of a metre of the way: neighbouring readings repeat each other.
  struct Station {
    Time time = 0;
    Vector3 position = Vector3::Zero();
    Vector3 field_ut = Vector3::Zero();  // map axes
    double field_odds = 0.0;
  };
  bool is_next_station(const PlaceEvidence& evidence, const Estimate& causal) const;
  static double add_odds(double sum, const Station& station) { return sum + station.field_odds; }

  static constexpr double kNeverConfirmed_s = 1e6;

  /// Time in which a position is that of the IMU alone, and of it, without IMU.
  struct DeadReckoning {
    double time_s = 0.0;
    double gap_s = 0.0;
    void add(double step_s, const ScanBundle& bundle);
    double sigma_m(double acceleration_m_s2) const;
  };

  PlaceJudge judge_;
  bool has_scans_;  // that are compared with a cloud map
  bool by_field_;   // there is a field map alone
  Reckoning reckoning_;
  double initial_velocity_m_s_;  // one sigma
  double tilt_m_s2_;             // gravity's part along the axes of a LiDAR mounted as the platform file says
  MotionCheck motion_;
  NearbyCheck nearby_;
  std::vector<Time> unclear_;       // scans since one was last seen to fit nowhere better
  std::optional<double> scan_fit_;  // mean over half a second; none before the first scan with points
  std::deque<Station> stations_;
  double field_weight_ = 1.0;         // Huber weight of readings, mean over seconds
  double field_alone_ = 0.0;          // share of these seconds in which they alone observe a direction
  double odds_decide_ = 0.0;          // share of these seconds in which the odds of readings decide
  DeadReckoning unobserved_;          // since all directions were last observed
  double observed_s_ = 0.0;           // since one was last unobserved
  double learned_s_ = 0.0;            // observed, in all
  bool astray_ = false;               // lost by dead reckoning: what is observed since then may be another place
  std::optional<Time> awaits_since_;  // lost on a field map alone: until readings fit
  double unconfirmed_s_ = kNeverConfirmed_s;  // since readings of several stations last fitted the estimate
  DeadReckoning reckoned_;                    // of these, without scans that observe every direction and fit
  Time last_ = 0;
  std::vector<Time> contradicting_;   // scans that contradict the maps, without a break until now
  std::map<Time, Verdict> verdicts_;  // by evidence; good ones are not kept
};

}  // namespace lodestone
