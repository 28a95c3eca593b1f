# Weights from scratch: `make weights ARGS='MESHES=FOLDER SIZE=large'`, resumable at every step.
#
# Renders the training data, trains the network, its view policy, the tables of its quality, its depth
# refiner and a segmenter, and puts all of it, exported, into RUN/weights. What stands is not made again, an
# interrupted training continues. The numbers below are about those of the weights that ship, whose
# stages were trained one after the other, two of them side by side; fewer are faster.
#
#   MESHES    folder with manifest.csv of real models (docs/data-sources.csv); without, none are used
#   RUN       folder of data and runs, some 8 GB
#   STEPS     of the small network; two cores take about an hour for 3,200
#   SIZE      small, or large for the default as well: it begins with the small network's weights, made
#             wider, and learns from objects that are made meanwhile, in MAKE_PROCESSES processes;
#             for a graphics card

RUN ?= runs/default
MESHES ?=
STEPS ?= 25300
SIZE ?= small
LARGE_STEPS ?= 4650
LARGE_BATCH ?= 96
MAKE_PROCESSES ?= $(shell expr \( $$(nproc) + 1 \) / 2)
MADE ?=
DEVICES ?= 2
PARAMETRIC ?= --train 320 --val 8
THINGS ?= --category thing --train 6000 --val 0
TURNTABLE ?= --train 60 --val 12
TURNTABLE_THINGS ?= --category thing --train 800 --val 0
DOME ?= --train 30 --val 5
DOME_THINGS ?= --category thing --train 400 --val 0
DEEP ?= --train 40 --val 8
DEEP_THINGS ?= --category thing --train 500 --val 0
POLICY ?= --objects 270 --epochs 20 --workers 2 --threads 1
DEPTH_STEPS ?= 1500
SEGMENTER_STEPS ?= 19000
KNOWN_OBJECTS ?= 500
FAULTS ?= unknown pose object_size mask
KINDS ?= even attention

AR ?= .venv/bin/active-recon
OF := $(if $(filter large,$(SIZE)),-large)
BUILD := $(AR) dataset build
NO_TEST := --test 0 --unseen 0
ANY := --cameras any --fine --turned
REAL := $(if $(MESHES),real_train)
REAL_VAL := $(if $(MESHES),real_val)
NAMES := .safetensors .json -scorer.safetensors -scorer.json -quality.json -depth.safetensors \
	-depth.json

.DELETE_ON_ERROR:
.PHONY: weights
weights: $(RUN)/exported$(OF)

# Data: one stamp each, so that a second start renders only what is missing
$(RUN)/data.rendered:
	@mkdir -p $(RUN)
	$(BUILD) $(RUN)/data $(PARAMETRIC) $(NO_TEST) $(ANY)
	@touch $@
$(RUN)/things.rendered:
	@mkdir -p $(RUN)
	$(BUILD) $(RUN)/things $(THINGS) $(NO_TEST) $(ANY)
	@touch $@
$(RUN)/turn.rendered:
	@mkdir -p $(RUN)
	$(BUILD) $(RUN)/turn $(TURNTABLE) $(NO_TEST) --fine
	$(BUILD) $(RUN)/turn_things $(TURNTABLE_THINGS) $(NO_TEST) --fine
	@touch $@
$(RUN)/dome.rendered:
	@mkdir -p $(RUN)
	$(BUILD) $(RUN)/dome $(DOME) $(NO_TEST) --fine --cameras dome
	$(BUILD) $(RUN)/dome_things $(DOME_THINGS) $(NO_TEST) --fine --cameras dome
	@touch $@
$(RUN)/deep.rendered:
	@mkdir -p $(RUN)
	$(BUILD) $(RUN)/deep $(DEEP) $(NO_TEST) $(ANY) --depth
	$(BUILD) $(RUN)/deep_things $(DEEP_THINGS) $(NO_TEST) $(ANY) --depth
	@touch $@
$(RUN)/real_train.rendered:
	@mkdir -p $(RUN)
	$(AR) render $(MESHES)/manifest.csv $(RUN)/real_train --split train --explicit-licence \
		$(ANY) --depth
	$(AR) render $(MESHES)/manifest.csv $(RUN)/turn_real --split train --explicit-licence --fine
	$(AR) render $(MESHES)/manifest.csv $(RUN)/dome_real --split train --explicit-licence --fine \
		--cameras dome
	@touch $@
$(RUN)/real_val.rendered:
	@mkdir -p $(RUN)
	$(AR) render $(MESHES)/manifest.csv $(RUN)/real_val --split val --fine
	$(AR) render $(MESHES)/manifest.csv $(RUN)/any_real_val --split val $(ANY)
	@touch $@

# The networks. All that belongs to one is made for that of SIZE
SMALL := $(RUN)/lifting/weights
NETWORK := $(RUN)/lifting$(OF)/weights
SCORER := $(RUN)/policy$(OF)/weights-scorer.safetensors
REFINER := $(RUN)/depth$(OF)/weights-depth.safetensors
QUALITY := $(RUN)/quality$(OF)
$(SMALL).safetensors: $(RUN)/data.rendered $(RUN)/things.rendered $(RUN)/turn.rendered \
		$(REAL:%=$(RUN)/%.rendered)
	$(AR) train $(RUN)/data/train $(RUN)/things/train $(REAL:%=$(RUN)/%) \
		$(RUN)/turn/train $(RUN)/turn_things/train $(REAL:%=$(RUN)/turn_real) \
		--validation $(RUN)/data/val --validation $(RUN)/turn/val \
		--out $(RUN)/lifting --model lifting --steps $(STEPS) \
		--batch-size 8 --learning-rate 1.2e-3 --max-views 8 --curriculum-fraction 0 \
		--warmup-steps 100 --checkpoint-every 100 --devices $(DEVICES) --threads 1 --resume

$(RUN)/lifting-large/weights.safetensors: $(SMALL).safetensors
	$(AR) train --make $(MAKE_PROCESSES) $(MESHES:%=--meshes %/manifest.csv) $(MADE) \
		--validation $(RUN)/data/val --validation $(RUN)/turn/val \
		--out $(@D) --model lifting --init-from $(SMALL).safetensors --widen-to large \
		--steps $(LARGE_STEPS) --batch-size $(LARGE_BATCH) --learning-rate 1e-3 --max-views 8 \
		--curriculum-fraction 0 --checkpoint-every 100 --resume

# What belongs to it: the view policy, the quality's tables, the depth refiner
$(SCORER): $(NETWORK).safetensors $(RUN)/turn.rendered \
		$(RUN)/dome.rendered
	$(AR) train-policy $(RUN)/turn/train $(RUN)/turn_things/train $(REAL:%=$(RUN)/turn_real) \
		$(RUN)/dome/train $(RUN)/dome_things/train $(REAL:%=$(RUN)/dome_real) \
		--validation $(RUN)/turn/val --validation $(RUN)/dome/val \
		--model $(NETWORK).safetensors --out $(@D) $(POLICY)
	@cp $(@D)/weights-scorer.* $(dir $(NETWORK))

MEASURE = $(AR) quality measure --model $(NETWORK).safetensors
JUDGED := $(if $(REAL_VAL),$(RUN)/real_val,$(RUN)/turn/val)
JUDGED_ANY := $(if $(REAL_VAL),$(RUN)/any_real_val,$(RUN)/data/val)
$(QUALITY)/known-%.npz: $(NETWORK).safetensors $(RUN)/turn.rendered
	@mkdir -p $(@D)
	$(MEASURE) $(RUN)/$*/train $@ --views 6 --objects $(KNOWN_OBJECTS)
$(QUALITY)/known-turn_real.npz: $(NETWORK).safetensors $(RUN)/real_train.rendered
	@mkdir -p $(@D)
	$(MEASURE) $(RUN)/turn_real $@ --views 6 --objects $(KNOWN_OBJECTS)
$(QUALITY)/known-any_real.npz: $(NETWORK).safetensors $(RUN)/real_train.rendered
	@mkdir -p $(@D)
	$(MEASURE) $(RUN)/real_train $@ --views 6 --objects $(KNOWN_OBJECTS)
$(QUALITY)/judged.npz: $(NETWORK).safetensors $(RUN)/turn.rendered \
		$(REAL_VAL:%=$(RUN)/%.rendered)
	@mkdir -p $(@D)
	$(MEASURE) $(JUDGED) $@ --views 6
$(QUALITY)/judged-by-%.npz: $(QUALITY)/judged.npz $(SCORER)
	$(MEASURE) $(JUDGED) $@ --views 6 --kind $*
$(QUALITY)/judged-%.npz: $(QUALITY)/judged.npz
	$(MEASURE) $(JUDGED) $@ --views 6 --fault $*
$(QUALITY)/judged-any.npz: $(QUALITY)/judged.npz
	$(MEASURE) $(JUDGED_ANY) $@ --views 6
$(QUALITY)/judged-any-by-%.npz: $(QUALITY)/judged.npz $(SCORER)
	$(MEASURE) $(JUDGED_ANY) $@ --views 6 --kind $*
$(QUALITY)/judged-any-%.npz: $(QUALITY)/judged.npz
	$(MEASURE) $(JUDGED_ANY) $@ --views 6 --fault $*
KNOWN := turn turn_things data things $(if $(REAL),turn_real any_real)
$(NETWORK)-quality.json: $(KNOWN:%=$(QUALITY)/known-%.npz) \
		$(QUALITY)/judged.npz $(FAULTS:%=$(QUALITY)/judged-%.npz) \
		$(KINDS:%=$(QUALITY)/judged-by-%.npz) \
		$(QUALITY)/judged-any.npz $(FAULTS:%=$(QUALITY)/judged-any-%.npz) \
		$(KINDS:%=$(QUALITY)/judged-any-by-%.npz)
	$(AR) quality fit --model $(NETWORK).safetensors --out $@ \
		$(patsubst %,--known %,$(filter $(QUALITY)/known%,$^)) \
		$(patsubst %,--calibration %,$(filter $(QUALITY)/judged%,$^))

$(REFINER): $(NETWORK).safetensors $(RUN)/deep.rendered
	$(AR) train-depth $(RUN)/deep/train $(RUN)/deep_things/train $(REAL:%=$(RUN)/%) \
		--validation $(RUN)/deep/val --model $(NETWORK).safetensors --out $(@D) \
		--steps $(DEPTH_STEPS) --threads 1 --resume

# What goes with every network: the segmenter
$(RUN)/segmenter/segmenter.safetensors: $(SMALL).safetensors $(RUN)/data.rendered \
		$(RUN)/things.rendered $(RUN)/turn.rendered $(REAL:%=$(RUN)/%.rendered)
	$(AR) train-segmenter $(RUN)/data/train $(RUN)/things/train $(REAL:%=$(RUN)/%) \
		$(RUN)/turn/train $(RUN)/turn_things/train $(REAL:%=$(RUN)/turn_real) \
		--validation $(RUN)/data/val --init-from $(SMALL).safetensors --out $(@D) \
		--steps $(SEGMENTER_STEPS) --learning-rate 1.5e-3 --warmup-steps 200 \
		--devices $(DEVICES) --threads 1 --resume

# All of it in one folder, under the name by which it is loaded
WRITTEN := $(RUN)/weights/lifting$(OF)
$(RUN)/exported$(OF): $(NETWORK).safetensors $(SCORER) \
		$(NETWORK)-quality.json $(REFINER) \
		$(RUN)/segmenter/segmenter.safetensors
	@mkdir -p $(RUN)/weights
	@for name in $(NAMES); do for stage in lifting policy depth; do \
		if test -e $(RUN)/$$stage$(OF)/weights$$name; then \
		cp $(RUN)/$$stage$(OF)/weights$$name $(WRITTEN)$$name; fi; done; done
	@cp $(RUN)/segmenter/segmenter.safetensors $(RUN)/segmenter/segmenter.json $(RUN)/weights
	$(AR) export $(WRITTEN).safetensors
	$(AR) export $(RUN)/weights/segmenter.safetensors
	@touch $@
	@echo "wrote $(RUN)/weights: load it by --model or the parameter weights, \
	$(WRITTEN).safetensors; the segmenter beside it by the parameter segmenter"
