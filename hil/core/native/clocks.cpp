#include "clocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "exact.hpp"

namespace core {
namespace {

constexpr std::int64_t kWrap_us = std::int64_t{1} << 32, kHalfWrap_us = std::int64_t{1} << 31;

// Prior on how the excess of a round trip splits between the two ways: both are alike, give or take;
// anything, where answers may have waited on the board's port.
constexpr double kAsymmetryClear = 0.08, kAsymmetryAny = 0.577;
// Share of the excess by which frames held up by those before them may still put the middle off.
constexpr double kHeldRatio = 0.05;
// An answer stamped in the first half of a report's period may have waited behind that report on the
// board's port; once there are so many that did not, the tie is made of these.
constexpr std::size_t kClearWanted = 8;
// The soonest report of each half second follows the board's rate; so many of them are kept.
constexpr double kSoonest_s = 0.5;
constexpr std::size_t kSoonestKept = 64, kSoonestWanted = 12;
// Prior on the rate of the board's clock: a ceramic resonator is good to 0.5 % (5,000 ppm).
constexpr double kDriftPriorRatio = 5e-3;
// Resolution below which nothing is claimed: the board may stamp in 4 us, the host in polls.
constexpr double kFloor_s = 50e-6;

// A stamp later than the tie by more is not the camera's jitter: so many sigma of the scatter, and this
// much where there is hardly any, or (the second) before the scatter is known.
constexpr double kOddSigmas = 5.0, kOdd_s = 0.02, kOddAtFirst_s = 0.2;
constexpr std::size_t kScatterFrames = 16;
// So many odd frames in a row that agree with each other mean that the camera's clock has stepped.
constexpr std::size_t kStepFrames = 4;

struct Rate {
  double drift, variance;
};
struct Point {
  double t, excess, lag;
};
// Lag at t = 0 and its variance at mean_t_s, drift and its variance.
struct Fit {
  double lag_s, drift, mean_t_s, var_s2, var_drift;
};

// Drift and its variance from the soonest reports (board s, arrival s) but the newest, whose half second is
// not over. Reports that stand out are left out: shorter ones come sooner. Without enough it is the prior.
Rate rate_of(const std::vector<std::pair<double, double>>& soonest) {
  const double prior = kDriftPriorRatio * kDriftPriorRatio;
  std::vector<std::pair<double, double>> points;
  for (std::size_t i = 0; i + 1 < soonest.size(); ++i) {
    points.emplace_back(soonest[i].first, soonest[i].second - soonest[i].first);
  }
  std::vector<double> off_s;
  double tt = 0.0, drift = 0.0;
  std::size_t n = 0;
  for (int round = 0; round < 3; ++round) {
    n = points.size();
    if (n < kSoonestWanted) return {0.0, prior};
    const double count = static_cast<double>(n);
    double sum_t = 0.0, sum_y = 0.0;
    for (const auto& [t, y] : points) sum_t += t;
    for (const auto& [t, y] : points) sum_y += y;
    const double mean_t = sum_t / count, mean_y = sum_y / count;
    double ty = 0.0;
    tt = 0.0;
    for (const auto& [t, y] : points) tt += power(t - mean_t, 2.0);
    for (const auto& [t, y] : points) ty += (t - mean_t) * (y - mean_y);
    drift = ty / tt;
    off_s.clear();
    for (const auto& [t, y] : points) off_s.push_back(std::fabs(y - mean_y - drift * (t - mean_t)));
    std::vector<double> sorted = off_s;
    std::sort(sorted.begin(), sorted.end());
    const double limit_s = 4.0 * sorted[n / 2] + kFloor_s;
    std::vector<std::pair<double, double>> kept;
    for (std::size_t i = 0; i < n; ++i) {
      if (off_s[i] <= limit_s) kept.push_back(points[i]);
    }
    if (kept.size() == n) break;  // the same once more
    points = std::move(kept);
  }
  double squares = 0.0;
  for (const double off : off_s) squares += off * off;
  const double noise = squares / (static_cast<double>(n) - 2.0) + kFloor_s * kFloor_s;
  const double precision = tt / noise + 1.0 / prior;
  return {drift * tt / noise / precision, 1.0 / precision};
}

// Fits lag = offset + drift t + asymmetry excess. `rate` is what is known of the drift before, the asymmetry
// is known to asymmetry_sigma about 0; unseen_s is how far the smallest excess may be off.
Fit regress(const std::vector<Point>& points, const Rate& rate, double asymmetry_sigma, double unseen_s) {
  const double n = static_cast<double>(points.size());
  double mean_t = 0.0, mean_e = 0.0, mean_y = 0.0, squares = 0.0;
  for (const Point& p : points) {
    mean_t += p.t;
    mean_e += p.excess;
    mean_y += p.lag;
    squares += p.excess * p.excess;
  }
  mean_t /= n;
  mean_e /= n;
  mean_y /= n;
  // An excess e split at random between the two ways puts the middle off by e/2 uniformly.
  const double assumed = squares / (3.0 * n) + power(unseen_s, 2.0) + kFloor_s * kFloor_s;
  double tt0 = 0.0, ee0 = 0.0, te = 0.0, ty = 0.0, ey = 0.0, yy = 0.0;
  for (const Point& p : points) {
    const double t = p.t - mean_t, e = p.excess - mean_e;
    const double y = p.lag - mean_y - rate.drift * (p.t - mean_t);
    tt0 += t * t;
    ee0 += e * e;
    te += t * e;
    ty += t * y;
    ey += e * y;
    yy += y * y;
  }
  double noise = assumed, drift = 0.0, asymmetry = 0.0, ee = 0.0, tt = 0.0, det = 0.0;
  for (int round = 0; round < 6;
       ++round) {  // each time with the noise found: a split that is plain is believed
    tt = tt0 + noise / rate.variance;
    ee = ee0 + noise / power(asymmetry_sigma, 2.0);
    det = tt * ee - te * te;
    drift = (ty * ee - ey * te) / det;
    asymmetry = (ey * tt - ty * te) / det;
    const double explained = drift * (2.0 * ty - drift * tt0) + asymmetry * (2.0 * ey - asymmetry * ee0);
    const double residual = std::max(yy - explained + 2.0 * drift * asymmetry * te, 0.0);
    // Four pseudo-observations of the assumed noise keep a lucky handful of points modest.
    noise = (residual + 4.0 * assumed) / (n + 2.0);
  }
  return {mean_y - (rate.drift + drift) * mean_t - asymmetry * mean_e, rate.drift + drift, mean_t,
          noise / n + (noise * tt / det + power(kHeldRatio, 2.0)) * power(mean_e, 2.0) +
              power(unseen_s, 2.0) / 3.0,
          noise * ee / det};
}

}  // namespace

void BoardClock::forget() {
  window_.clear();
  ref_us_ = 0;
  ref_s_ = 0.0;
  report_us_ = period_us_ = -1;
  soonest_.clear();
  soonest_until_us_ = 0;
  rate_ = 1e-6;
  mean_us_ = 0;
  var_s2_ = std::numeric_limits<double>::infinity();
  var_drift_ = kDriftPriorRatio * kDriftPriorRatio;
  rtt_s = std::numeric_limits<double>::quiet_NaN();
  bound_s = std::numeric_limits<double>::infinity();
}

bool BoardClock::exchange(double t_send_s, double t_receive_s, std::int64_t t_mcu_us) {
  const double round_s = t_receive_s - t_send_s;
  if (!(0.0 <= round_s && round_s <= limit_s_)) {
    ++refused;
    return false;
  }
  const std::int64_t unwrapped_us = unwrap(t_mcu_us);
  const double mid_s = 0.5 * (t_send_s + t_receive_s);
  if (ready() && impossible(unwrapped_us, mid_s, round_s)) {
    forget();  // the board's clock jumped: it was reset
    ++restarts;
  }
  last_us_ = ready() ? std::max(last_us_, unwrapped_us) : unwrapped_us;
  if (window_.size() == most_) window_.pop_front();
  window_.push_back({unwrapped_us, mid_s, round_s, is_clear(unwrapped_us)});
  rtt_s = round_s;
  ++exchanges;
  fit();
  return true;
}

void BoardClock::report(std::int64_t t_mcu_us, double t_arrival_s) {
  if (!ready()) return;
  const std::int64_t unwrapped_us = unwrap(t_mcu_us);
  if (0 <= report_us_ && report_us_ < unwrapped_us) period_us_ = unwrapped_us - report_us_;
  report_us_ = unwrapped_us;
  if (soonest_.empty() || unwrapped_us >= soonest_until_us_) {
    if (soonest_.size() == kSoonestKept) soonest_.pop_front();
    soonest_.emplace_back(unwrapped_us, t_arrival_s);
    soonest_until_us_ = unwrapped_us + rounded(kSoonest_s * 1e6);
    return;
  }
  const auto [before_us, before_s] = soonest_.back();
  if (t_arrival_s - before_s < static_cast<double>(unwrapped_us - before_us) * rate_) {
    soonest_.back() = {unwrapped_us, t_arrival_s};
  }
}

// Whether the board's port was free of the last report when it answered.
bool BoardClock::is_clear(std::int64_t unwrapped_us) const {
  const std::int64_t since_us = unwrapped_us - report_us_;
  return period_us_ > 0 && !(0 <= 2 * since_us && 2 * since_us < period_us_);
}

double BoardClock::to_host_s(std::int64_t t_mcu_us) {
  const std::int64_t unwrapped_us = unwrap(t_mcu_us);
  last_us_ = std::max(last_us_, unwrapped_us);
  return ref_s_ + static_cast<double>(unwrapped_us - ref_us_) * rate_;
}

std::int64_t BoardClock::unwrap(std::int64_t t_mcu_us) const {
  const std::int64_t ahead_us = ((t_mcu_us - last_us_ + kHalfWrap_us) & (kWrap_us - 1)) - kHalfWrap_us;
  return last_us_ + ahead_us;
}

double BoardClock::sigma_at(std::int64_t unwrapped_us) const {
  const double lead_s = static_cast<double>(unwrapped_us - mean_us_) * 1e-6;
  return std::sqrt(var_s2_ + var_drift_ * lead_s * lead_s);
}

// Whether the stamp lies outside its exchange by more than the tie allows.
bool BoardClock::impossible(std::int64_t unwrapped_us, double mid_s, double round_s) const {
  const double predicted_s = ref_s_ + static_cast<double>(unwrapped_us - ref_us_) * rate_;
  const double margin_s = 6.0 * sigma_at(unwrapped_us);
  return std::fabs(predicted_s - mid_s) > 0.5 * round_s + bound_s + margin_s;
}

// Least squares for offset, drift and asymmetry; the last two are held by priors.
void BoardClock::fit() {
  std::size_t clear = 0;
  double shortest_s = window_.front().rtt_s, longest_s = shortest_s;
  for (const Exchange& x : window_) {
    clear += x.clear ? 1 : 0;
    shortest_s = std::min(shortest_s, x.rtt_s);
    longest_s = std::max(longest_s, x.rtt_s);
  }
  const bool are_clear = clear >= kClearWanted;
  // The shortest of n round trips is itself above the true floor by about spread/(n+1).
  const double spread_s =
      std::max(longest_s - shortest_s, shortest_s) / static_cast<double>(window_.size() + 1);
  const Exchange ref = window_.back();
  std::vector<double> rtts_s;
  for (const Exchange& x : window_) {
    if (x.clear || !are_clear) rtts_s.push_back(x.rtt_s);
  }
  std::sort(rtts_s.begin(), rtts_s.end());
  // Exchanges whose excess is at most four times the median excess.
  const double gate_s = shortest_s + 4.0 * (rtts_s[(rtts_s.size() - 1) / 2] - shortest_s);
  std::vector<Point> points;
  for (const Exchange& x : window_) {
    if ((are_clear && !x.clear) || !(x.rtt_s <= gate_s)) continue;
    const double t_s = static_cast<double>(x.t_mcu_us - ref.t_mcu_us) * 1e-6;
    points.push_back({t_s, 0.5 * (x.rtt_s - shortest_s), x.t_mid_s - ref.t_mid_s - t_s});
  }
  std::vector<std::pair<double, double>> soonest;
  for (const auto& [us, t_s] : soonest_) {
    soonest.emplace_back(static_cast<double>(us - ref.t_mcu_us) * 1e-6, t_s);
  }
  const Fit fit = regress(points, rate_of(soonest), are_clear ? kAsymmetryClear : kAsymmetryAny,
                          0.5 * std::min(spread_s, shortest_s));
  ref_us_ = ref.t_mcu_us;
  ref_s_ = ref.t_mid_s + fit.lag_s;
  rate_ = (1.0 + fit.drift) * 1e-6;
  mean_us_ = ref.t_mcu_us + rounded(fit.mean_t_s * 1e6);
  var_s2_ = fit.var_s2;
  var_drift_ = fit.var_drift;
  bound_s = 0.5 * shortest_s;
}

double CameraClock::sigma_s() const {
  const std::size_t count = sorted_s_.size();
  // The median of n has 1.253 times the standard error of a mean.
  return count > 1 ? 1.253 * scatter_s() / std::sqrt(static_cast<double>(count))
                   : std::numeric_limits<double>::infinity();
}

bool CameraClock::arrival(double t_cam_s, double t_host_s) {
  const double gap_s = t_host_s - t_cam_s;
  if (!std::isfinite(gap_s)) {
    ++refused;
    return false;
  }
  if (is_odd(t_cam_s, gap_s)) {
    odd_s_.push_back(gap_s);
    if (!has_stepped()) {
      ++refused;
      return false;
    }
    restart();
  } else {
    odd_s_.clear();
    take(gap_s);
  }
  newest_cam_s_ = t_cam_s;
  return true;
}

double CameraClock::median_s() const {
  const std::size_t count = sorted_s_.size();
  if (count == 0) return std::numeric_limits<double>::quiet_NaN();
  return 0.5 * (sorted_s_[(count - 1) / 2] + sorted_s_[count / 2]);
}

// Half the inter-quartile range over 0.674: sigma of a normal scatter.
double CameraClock::scatter_s() const {
  const std::size_t count = sorted_s_.size();
  const double quartiles_s = sorted_s_[(3 * count) / 4] - sorted_s_[count / 4];
  return quartiles_s / (2.0 * 0.674);
}

double CameraClock::margin_s() const {
  if (sorted_s_.size() < kScatterFrames) return kOddAtFirst_s;
  return std::max(kOdd_s, kOddSigmas * scatter_s());
}

// Whether no delay explains the stamp; once one is odd, also those that go with it.
bool CameraClock::is_odd(double t_cam_s, double gap_s) const {
  if (!ready()) return false;
  const double off_s = gap_s - median_s(), margin = margin_s();
  if (off_s < -margin || t_cam_s < newest_cam_s_) return true;
  return !odd_s_.empty() && off_s > margin;
}

// Whether the last odd frames agree, as far as the jitter lets them.
bool CameraClock::has_stepped() const {
  if (odd_s_.size() < kStepFrames) return false;
  const auto [least, most] = std::minmax_element(odd_s_.end() - kStepFrames, odd_s_.end());
  return *most - *least <= margin_s();
}

// Begins anew with the frames that agree.
void CameraClock::restart() {
  const double before_s = median_s();
  const std::vector<double> last_s(odd_s_.end() - kStepFrames, odd_s_.end());
  gaps_s_.clear();
  sorted_s_.clear();
  odd_s_.clear();
  for (const double gap_s : last_s) take(gap_s);
  step_s = before_s - median_s();
  ++restarts;
}

void CameraClock::take(double gap_s) {
  gaps_s_.push_back(gap_s);
  sorted_s_.insert(std::upper_bound(sorted_s_.begin(), sorted_s_.end(), gap_s), gap_s);
  if (gaps_s_.size() > most_) {
    sorted_s_.erase(std::lower_bound(sorted_s_.begin(), sorted_s_.end(), gaps_s_.front()));
    gaps_s_.pop_front();
  }
}

}  // namespace core
