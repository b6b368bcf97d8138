// Pinocchio's own code generation: its ABA on CasADi's symbols, written as C.
//   pinocchio_casadi planar|spatial N baked|given OUT.c
// The chains are those of bench/systems.py: point masses with joint angles, and the spatial arm. `given`: gravity, masses and
// sizes are symbols, in the order of F's third argument: g, then masses and lengths (planar), or m, c, across, along (spatial).
#include <cstdlib>
#include <cstring>
#include <string>

#include <pinocchio/autodiff/casadi.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <casadi/casadi.hpp>

using Symbol = ::casadi::SX;
using Vector = Eigen::Matrix<Symbol, -1, 1>;

int main(int count, char **words)
{
    if (count != 5) return 1;
    const bool spatial = !std::strcmp(words[1], "spatial"), given = !std::strcmp(words[3], "given");
    const int n = std::atoi(words[2]), each = spatial ? 4 : 2;
    const Symbol p = Symbol::sym("p", 1 + each * n);
    auto size = [&](int kind, int i, double baked) { return given ? p(1 + kind * n + i) : Symbol(baked); };

    pinocchio::Model shape;
    pinocchio::JointIndex parent = 0;
    for (int i = 0; i < n; i++) {
        const auto seat = pinocchio::SE3::Identity();
        const std::string name = "j" + std::to_string(i);
        if (!spatial || i % 3 == 2) parent = shape.addJoint(parent, pinocchio::JointModelRZ(), seat, name);
        else if (i % 3 == 0) parent = shape.addJoint(parent, pinocchio::JointModelRX(), seat, name);
        else parent = shape.addJoint(parent, pinocchio::JointModelRY(), seat, name);
    }
    auto model = shape.cast<Symbol>();
    typedef decltype(model) Model;
    model.gravity.linear() << Symbol(0), given ? Symbol(-p(0)) : Symbol(-9.81), Symbol(0);
    for (int i = 0; i < n; i++) {
        const Symbol zero = 0, m = size(0, i, 1), l = size(1, i, spatial ? 0.5 : 1);
        Eigen::Matrix<Symbol, 3, 3> about = Eigen::Matrix<Symbol, 3, 3>::Zero();
        if (spatial) about.diagonal() << size(2, i, 0.1), size(3, i, 0.01), size(2, i, 0.1);
        model.inertias[i + 1] = Model::Inertia(m, Eigen::Matrix<Symbol, 3, 1>(zero, Symbol(-l), zero), about);
        if (i + 1 == n) break;
        model.jointPlacements[i + 2].translation() << zero, spatial ? Symbol(-1) : Symbol(-l), zero;
    }
    pinocchio::DataTpl<Symbol> data(model);
    const Symbol q = Symbol::sym("q", n), v = Symbol::sym("v", n);
    Vector q_of(n), v_of(n), tau(n);
    for (int i = 0; i < n; i++) q_of[i] = q(i), v_of[i] = v(i), tau[i] = 0;
    pinocchio::aba(model, data, q_of, v_of, tau, pinocchio::Convention::LOCAL);
    Symbol a(n, 1);
    for (int i = 0; i < n; i++) a(i) = data.ddq[i];
    const ::casadi::Function function("F", {q, v, p}, {a}, {{"cse", true}});
    ::casadi::CodeGenerator text{std::string(words[4])};
    text.add(function);
    text.generate("");
    return 0;
}
