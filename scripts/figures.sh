#!/usr/bin/env bash
# Writes the gallery: the figures of [Fecho13] as sateen takes them, and a page that shows them.
#
#     scripts/figures.sh [FOLDER] [SIZE]      default: target/gallery, pictures 384 pixels high; two minutes after the build.
#                                         SATEEN=PATH takes that tool; else it is built
set -euo pipefail
sateen=$("$(dirname "$0")/tool.sh")
cd "$(dirname "$0")/.."
folder=${1:-target/gallery}
size=${2:-384}
mkdir -p "$folder"

page="$folder/index.html"

# A picture, and on the page its name below it: SCENE NAME CAPTION ARGUMENTS…
picture() {
    local scene=$1 name=$2 caption=$3
    shift 3
    "$sateen" --quiet render "$scene" "$@" --transfer 2.2 --size "$size" -o "$folder/$name.png"
    echo "<figure><img src='$name.png' alt='$caption' loading='lazy'>" >>"$page"
    if [[ $scene == cylinders && -f "$folder/$name.svg" ]]; then
        echo "<img src='$name.svg' alt='radiance across each cylinder, $caption' loading='lazy'>" >>"$page"
    fi
    echo "<figcaption>$caption</figcaption></figure>" >>"$page"
}
section() {
    echo "<h2>$1</h2><p>$2</p>" >>"$page"
    echo "$1" >&2
}

cat >"$page" <<'HTML'
<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>sateen: gallery</title>
<style>
    body { font: 16px/1.5 sans-serif; max-width: 90rem; margin: 2rem auto; padding: 0 1rem; color: #1f2937; background: #fffffe }
    figure { display: inline-block; vertical-align: top; margin: 0 1rem 1.5rem 0 }
    figure img { display: block; max-width: 100%; max-height: 20rem; background: #111 }
    figure img[src$=svg] { background: none; max-height: 15rem }
</style>
<h1>Gallery</h1>
<p>The test scenes of M. Fecho, <i>An Evaluation of Appearance Models for Cloth Rendering</i>, 2013. Cylinders have their warp
vertical, horizontal and diagonal; every slice through the centre of a sphere is a cylinder. The light is at the camera unless it is
said where else.</p>
HTML

section "All fabrics" "Figure 6.8. The mapping of section 6.1.3, lit from 30° to the right."
for file in tables/fabrics/*.toml; do
    fabric=$(basename "$file" .toml)
    [[ $fabric == polka-dot-lining ]] && fabric=polka-dot-lining-pink
    picture sphere "sphere-$fabric" "$fabric" "$fabric" --light-deg 30
done

section "Sadeghi against Irawan" "Figures 4.2 to 4.7: the six fabrics of the paper, each by both models. Irawan's parameters are translated by table 4.1."
for fabric in linen-plain silk-crepe-de-chine polyester-satin-charmeuse-front polyester-satin-charmeuse-back silk-shot velvet; do
    picture cylinders "sadeghi-$fabric" "$fabric, Sadeghi" "$fabric"
    picture cylinders "irawan-$fabric" "$fabric, Irawan" "$fabric" --model irawan
done

section "Measured fabrics" "Figures 5.3 to 5.11."
for fabric in denim polyester-lining polka-dot-lining-pink swimwear-front swimwear-back tshirt-white tshirt-black-front tshirt-black-back faux-suede; do
    picture cylinders "cylinders-$fabric" "$fabric" "$fabric"
done

section "Stripes of two fabrics" "Figure 6.10: corduroy as wales and grooves."
picture cylinders corduroy-mean "corduroy, one fabric" corduroy
picture cylinders corduroy-stripes "corduroy, stripes" tables/patterns/corduroy.toml --repeats 40

section "Knit against woven" "Figure 6.1: the yarns of swimwear in the directions of a weft knit and of a weave, lit from 65° and from 20°."
for fabric in weft-knit weft-knit-curve swimwear-front; do
    for angle in 65 20; do
        picture cylinders "knit-$fabric-$angle" "$fabric, $angle°" "$fabric" --light-deg "$angle"
    done
done

section "Cloth that hangs" "Figures A.2 to A.4: three lights, with shadows."
for fabric in polyester-lining denim velvet polyester-satin-charmeuse-front; do
    picture curtain "curtain-$fabric" "$fabric" "$fabric"
done
picture curtain curtain-polka-dots "polka dots" tables/patterns/polka-dot-lining.toml --repeats 12
picture trousers trousers-denim denim denim --turn-deg 20
picture trousers trousers-corduroy "corduroy, stripes" tables/patterns/corduroy.toml --repeats 60

echo "</html>" >>"$page"
echo "$page"
