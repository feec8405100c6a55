#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "variolux/geostat/kriging.h"

/// Kriging of many scattered data in local (moving) neighbourhoods: each target from its nearest data only
/// (Chiles and Delfiner 2012, section 3.6). The k-d tree is nanoflann's.
namespace vlx {

/// Nearest neighbours among fixed points, with a tie rule, so that the answer does not depend on the order of
/// the points.
class NearestPoints {
  public:
    /// points: n x d, finite; a row that is not finite is never found.
    explicit NearestPoints(const Eigen::MatrixXd& points);
    ~NearestPoints();
    NearestPoints(NearestPoints&&) noexcept;
    NearestPoints& operator=(NearestPoints&&) noexcept;

    /// The `count` nearest points (Euclidean), nearest first; ties, also at the last place, by coordinates
    /// (lexicographic), and only between bitwise equal points by index. Fewer if there are fewer.
    std::vector<Eigen::Index> nearest(const Eigen::VectorXd& target, Eigen::Index count) const;

    /// All points with distance <= radius, in the same order.
    std::vector<Eigen::Index> within(const Eigen::VectorXd& target, double radius) const;

  private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

struct NeighbourhoodOptions {
    Eigen::Index most = 32;  ///< data a target uses: its nearest, measured by the problem's distance |T h|
    double radius = 0;       ///< further data are not used; 0 = no limit
};

/// What predictLocally found. The report is of all systems together: their fallbacks added up, the largest
/// jitter and condition estimate; its status is InvalidInput if the problem itself is.
struct NeighbourhoodPrediction {
    KrigingReport report;
    KrigingPrediction prediction;
    Eigen::Index systems = 0;  ///< factorised: targets in a row with the same data share one
};

/// Predicts each point target from its own neighbourhood. `targets` must be points (no blocks). A target
/// with no data near it is InvalidTarget (known mean: the mean), one with too few for its drift NotEstimable.
NeighbourhoodPrediction predictLocally(const KrigingProblem& problem, const KrigingTargets& targets,
                                       const NeighbourhoodOptions& options = {});

}  // namespace vlx
