#pragma once

#include <array>
#include <string_view>
#include <utility>

namespace lodestone {

/// How options are declared. An option struct has defaults and lists its fields in one place:
///
///   struct MaskOptions {
///     double max_sigma_m = 0.05;
///     MaskRule rule = MaskRule::marginal;
///     template <class Visitor> void visit(Visitor& visitor) {
///       visitor.field("max_sigma_m", max_sigma_m, "a direction is degenerate above this predicted sigma");
///       visitor.field("rule", rule, "which analysis decides");     // an enum with enum_names, found by ADL
///       visitor.section("huber", huber);                           // a nested option struct
///     }
///     void check() const;   // optional: throws InputError where values are out of range
///   };
///
/// Fields are bool, int, double, std::string, an enum with `enum_names`, or std::vector<double>. Readers, writers and
/// help texts are visitors, which know no struct. Names carry units.
///
/// An enum becomes an option by this function beside the enum, found by argument-dependent look-up:
///
///   constexpr auto enum_names(MaskRule) {
///     return EnumNames<MaskRule, 2>{{{MaskRule::none, "none"}, {MaskRule::marginal, "marginal"}}};
///   }
template <class Enum, std::size_t count>
using EnumNames = std::array<std::pair<Enum, std::string_view>, count>;

}  // namespace lodestone
