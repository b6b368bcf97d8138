// Nanoseconds of one forward dynamics by Pinocchio: pinocchio_chain planar|spatial N
//
// planar: point masses on hinges; spatial: hinges about x, y, z in turn, bodies with a diagonal inertia. The same
// chains as in systems.py. Prints the articulated-body algorithm in both conventions: the best of 40 batches.
#include <pinocchio/multibody.hpp>

#include <pinocchio/algorithm/aba.hpp>

#include <chrono>
#include <cstdio>
#include <cstring>

using namespace pinocchio;
using Clock = std::chrono::steady_clock;

template <class F> double nanoseconds(F evaluate)
{
    auto batch = [&](long n) {
        auto begun = Clock::now();
        for (long k = 0; k < n; k++) evaluate(k & 15);
        return std::chrono::duration<double>(Clock::now() - begun).count();
    };
    long n = 16;
    while (batch(n) < 2e-3) n *= 2;
    double best = 1e300;
    for (int r = 0; r < 40; r++) best = std::min(best, batch(n) * 1e9 / n);
    return best;
}

int main(int argc, char **argv)
{
    if (argc != 3) return 2;
    const bool spatial = !strcmp(argv[1], "spatial");
    const int n = atoi(argv[2]);
    Model model;
    model.gravity.linear(Eigen::Vector3d(0, -9.81, 0));
    JointIndex parent = 0;
    for (int i = 0; i < n; i++) {
        SE3 seat = SE3::Identity();
        if (i) seat.translation() = Eigen::Vector3d(0, -1, 0);
        const std::string name = "j" + std::to_string(i);
        if (!spatial || i % 3 == 2) parent = model.addJoint(parent, JointModelRZ(), seat, name);
        else if (i % 3 == 0) parent = model.addJoint(parent, JointModelRX(), seat, name);
        else parent = model.addJoint(parent, JointModelRY(), seat, name);
        Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
        if (spatial) inertia.diagonal() << 0.1, 0.01, 0.1;
        model.appendBodyToJoint(parent, Inertia(1.0, Eigen::Vector3d(0, spatial ? -0.5 : -1, 0), inertia),
                                SE3::Identity());
    }
    Data data(model);
    std::vector<Eigen::VectorXd> q(16), v(16);
    const Eigen::VectorXd tau = Eigen::VectorXd::Zero(n);
    srand(1);
    for (int k = 0; k < 16; k++) {
        q[k] = Eigen::VectorXd::Random(n);
        v[k] = Eigen::VectorXd::Random(n);
    }
    const double local = nanoseconds([&](int k) { aba(model, data, q[k], v[k], tau, Convention::LOCAL); });
    const double world = nanoseconds([&](int k) { aba(model, data, q[k], v[k], tau, Convention::WORLD); });
    printf("%.1f %.1f\n", local, world);
}
