// Pinocchio's functions of a robot, called from C++: bench/robot_functions.py loads this as a library.
//
// A robot is a text of numbers, one line a joint after the gravity: parent, kind (0 revolute, 1 prismatic, 2
// free), axis, rotation by rows and translation of its place, mass, mass centre and inertia about it by rows.
#include <pinocchio/multibody.hpp>

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <ctime>
#include <sstream>
#include <vector>

using namespace pinocchio;
using Vector = Eigen::VectorXd;

namespace {

struct Robot {
    Model model;
    Data data;
    Data::Matrix6x J;
};

enum Function { ABA_LOCAL, ABA_WORLD, RNEA, CRBA_LOCAL, CRBA_WORLD, JACOBIAN };

struct State {
    Vector q, v, a; // a: torques for ABA
};

template <int N> Eigen::Matrix<double, N, 1> numbers(std::istream &from)
{
    Eigen::Matrix<double, N, 1> read;
    for (int k = 0; k < N; k++) from >> read[k];
    return read;
}

Eigen::Matrix3d rows(std::istream &from)
{
    const Eigen::Matrix<double, 9, 1> read = numbers<9>(from);
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(read.data());
}

JointIndex add(Model &model, JointIndex parent, int kind, const Eigen::Vector3d &axis, const SE3 &place)
{
    const std::string name = "joint" + std::to_string(model.njoints);
    const int along = axis.x() == 1 ? 0 : axis.y() == 1 ? 1 : axis.z() == 1 ? 2 : 3;
    if (kind == 2) return model.addJoint(parent, JointModelFreeFlyer(), place, name);
    if (kind == 1) {
        if (along == 0) return model.addJoint(parent, JointModelPX(), place, name);
        if (along == 1) return model.addJoint(parent, JointModelPY(), place, name);
        if (along == 2) return model.addJoint(parent, JointModelPZ(), place, name);
        return model.addJoint(parent, JointModelPrismaticUnaligned(axis), place, name);
    }
    if (along == 0) return model.addJoint(parent, JointModelRX(), place, name);
    if (along == 1) return model.addJoint(parent, JointModelRY(), place, name);
    if (along == 2) return model.addJoint(parent, JointModelRZ(), place, name);
    return model.addJoint(parent, JointModelRevoluteUnaligned(axis), place, name);
}

void evaluate(Robot &of, int function, const State &at)
{
    switch (function) {
    case ABA_LOCAL: aba(of.model, of.data, at.q, at.v, at.a, Convention::LOCAL); break;
    case ABA_WORLD: aba(of.model, of.data, at.q, at.v, at.a, Convention::WORLD); break;
    case RNEA: rnea(of.model, of.data, at.q, at.v, at.a); break;
    case CRBA_LOCAL: crba(of.model, of.data, at.q, Convention::LOCAL); break;
    case CRBA_WORLD: crba(of.model, of.data, at.q, Convention::WORLD); break;
    default: computeJointJacobian(of.model, of.data, at.q, of.model.njoints - 1, of.J);
    }
}

std::vector<State> states(const Robot &of, const double *given, int count)
{
    const long nq = of.model.nq, nv = of.model.nv;
    std::vector<State> all;
    for (int k = 0; k < count; k++, given += nq + 2 * nv)
        all.push_back({Eigen::Map<const Vector>(given, nq), Eigen::Map<const Vector>(given + nq, nv),
                       Eigen::Map<const Vector>(given + nq + nv, nv)});
    return all;
}

double seconds()
{
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

} // namespace

extern "C" {

Robot *robot_of(const char *text)
{
    std::istringstream from(text);
    Model model;
    model.gravity.linear(numbers<3>(from));
    long parent;
    while (from >> parent) {
        int kind;
        from >> kind;
        const Eigen::Vector3d axis = numbers<3>(from);
        const Eigen::Matrix3d turn = rows(from);
        const Eigen::Vector3d to = numbers<3>(from);
        double mass;
        from >> mass;
        const Eigen::Vector3d centre = numbers<3>(from);
        const Eigen::Matrix3d inertia = rows(from);
        const JointIndex joint = add(model, JointIndex(parent), kind, axis, SE3(turn, to));
        model.appendBodyToJoint(joint, Inertia(mass, centre, inertia), SE3::Identity());
    }
    Robot *made = new Robot{model, Data(model), Data::Matrix6x::Zero(6, model.nv)};
    return made;
}

// Write a result to `out` [nv], [nv, nv] or [6, nv], matrices by columns, of CRBA the upper triangle.
void result_of(Robot *of, int function, const double *state, double *out)
{
    const State at = states(*of, state, 1)[0];
    evaluate(*of, function, at);
    const long nv = of->model.nv;
    switch (function) {
    case ABA_LOCAL:
    case ABA_WORLD: Eigen::Map<Vector>(out, nv) = of->data.ddq; break;
    case RNEA: Eigen::Map<Vector>(out, nv) = of->data.tau; break;
    case CRBA_LOCAL:
    case CRBA_WORLD: Eigen::Map<Eigen::MatrixXd>(out, nv, nv) = of->data.M; break;
    default: Eigen::Map<Eigen::MatrixXd>(out, 6, nv) = of->J;
    }
}

// Processor seconds of many calls at one state after the other.
double time_of(Robot *of, int function, const double *given, int count, long calls)
{
    const std::vector<State> all = states(*of, given, count);
    const double begun = seconds();
    for (long k = 0; k < calls; k++) evaluate(*of, function, all[size_t(k % count)]);
    return seconds() - begun;
}
}
