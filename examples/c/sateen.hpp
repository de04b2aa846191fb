// A table that frees itself, and errors that are exceptions: as much of C++ as sateen.h wants.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>

#include <sateen.h>

namespace sateen {

using Vec3 = std::array<float, 3>;

// Throws what is wrong with arguments.
inline void check(sateen_status status) {
    if (status != SATEEN_OK) {
        throw std::invalid_argument(sateen_status_text(status));
    }
}

// Moves, is not copied; any number of threads may evaluate it.
class Table {
public:
    // Throws what is wrong with the file, and where.
    explicit Table(const std::string &path) {
        char message[512];
        sateen_table *table = nullptr;
        if (sateen_from_file(path.c_str(), &table, message, sizeof message) != SATEEN_OK) {
            throw std::runtime_error(message);
        }
        table_.reset(table);
    }

    // BRDF times cosine, 1/sr, linear RGB.
    Vec3 eval_cos(const Vec3 &wi, const Vec3 &wr) const {
        Vec3 rho;
        check(sateen_eval_cos(get(), wi.data(), wr.data(), rho.data()));
        return rho;
    }

    void eval_cos_batch(std::size_t pairs, sateen_directions wi, sateen_directions wr, sateen_colours rho) const {
        check(sateen_eval_cos_batch(get(), pairs, wi, wr, rho));
    }

    // For the other functions of sateen.h.
    const sateen_table *get() const { return table_.get(); }

private:
    struct Free {
        void operator()(sateen_table *table) const { sateen_free(table); }
    };
    std::unique_ptr<sateen_table, Free> table_;
};

}  // namespace sateen
